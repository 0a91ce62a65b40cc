function evaluate_typed(command, is_at_prompt)
% evaluate_typed  Evaluate what a person has typed on the desk, in the base workspace.
%
%   Its output and its errors appear here and on the desk.

text = '';
try
    text = evalc('evalin(''base'', command)');
catch failure
    text = sprintf('error: %s\n', failure.message);
end
lines = sprintf('>> %s\n%s', command, text);
if is_at_prompt
    lines = sprintf('\n%s>> ', lines);
end
fprintf('%s', lines);
if is_octave()
    fflush(stdout);
end
text = regexprep(text, '\n+$', '');
if ~isempty(text) && simulator('--is-running', [])
    simulator(['typed ' escaped(text(1:min(end, 40000)))]);
end
end
