function value = plain_text(value)
% plain_text  Turn a MATLAB string ("text") into a row of characters; leave anything else as it is.

if isa(value, 'string') && isscalar(value)
    value = char(value);
end
end
