function number = simulated_port(port)
% simulated_port  Return n for the simulated port -n, or for its reference.

if ~isnumeric(port) || isempty(port) || ~(port(1) <= -1) || isinf(port(1)) || port(1) ~= fix(port(1))
    error('kiks:argument', ['The port must be that of a simulated robot: -1, -2, ..., or its reference, but it ' ...
        'was %s. Leave it out for this program''s robot.'], shown(port));
end
number = -port(1);
end
