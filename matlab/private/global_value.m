function value = global_value(name, new_value) %#ok<INUSD>
% global_value  Return a global variable's value, [] if there is none, and set another if one is given.
%
%   KIKS_SESSIONACTIVE, the global variable of KiKS 2.2.0, is 1 from the start of a session or the opening of a port on:
%   where it is empty, a program has called `clear all`.

eval(['global ' name]);
value = eval(name);
if nargin > 1
    eval([name ' = new_value;']);
end
end
