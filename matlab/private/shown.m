function text = shown(value)
% shown  Describe a value in a few words, for messages.

if ischar(value) && size(value, 1) <= 1
    text = ['''' one_line(value) ''''];
elseif isnumeric(value) && isscalar(value)
    text = sprintf('%g', value);
elseif (isnumeric(value) || islogical(value)) && numel(value) <= 6 && ~isempty(value)
    text = mat2str(value, 6);
else
    size_text = sprintf('%dx', size(value));
    text = ['a ' size_text(1:end - 1) ' ' class(value)];
end
end
