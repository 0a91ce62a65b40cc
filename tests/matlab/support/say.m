function say(name, value)
% say  Tell a value to the test that runs this program.

fprintf('@%s %s %s\n', name, jsonencode(size(value)), jsonencode(value));
fflush(stdout);
end
