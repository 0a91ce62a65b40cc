function value = global_value(name, new_value) %#ok<INUSD>
% global_value  Return a global variable's value, [] if there is none, and set another if one is given.

eval(['global ' name]);
value = eval(name);
if nargin > 1
    eval([name ' = new_value;']);
end
end
