function greys = greys_of_kiks_2()
% greys_of_kiks_2  The greys of things in KiKS 2.2.0, for its rule of colours (kiks-behaviour.md 1.10).

greys = struct('KIKS_COLOR_BALL', 25, 'KIKS_COLOR_CYLINDER', 70, 'KIKS_COLOR_ROBOT', 120);
end
