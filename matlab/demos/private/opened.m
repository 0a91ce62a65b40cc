function ref = opened(port, baud)
% opened  Open a robot's port, given as a number or by its name.

if ischar(port)
    ref = kiks_kopen(port, baud, 1);
else
    ref = kiks_kopen([port baud 1]);
end
end
