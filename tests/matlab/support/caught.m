function text = caught(act)
% caught  Do something and return the error's 'identifier|message', '' if there was none.

text = '';
try
    act();
catch failure
    text = [failure.identifier '|' failure.message];
end
end
