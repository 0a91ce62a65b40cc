function values = kask(ref, request, prefix, count, tries)
% kask  Send a command, check its reply and return the numbers in it.
%
%   values = kask(ref, request, prefix, count, tries) sends request, up to tries times, until the reply is prefix and
%   count numbers. They are returned as a column, 0 if count is 0, and -1 if no try succeeds.

values = -1;
start = numel(prefix) + 1;
for attempt = 1:tries
    if isnumeric(ref) && numel(ref) == 4 && ref(1) == -1
        % kiks_ksend inlined, as programs send thousands of requests a second.
        reply = simulator(['ask 1 ' request]);
    else
        reply = kiks_ksend([request char(10)], ref);
    end
    if count == 0
        if strcmp(reply, prefix)
            values = 0;
            return
        end
    elseif strncmp(reply, prefix, start - 1)
        numbers = sscanf(reply(start:end), ',%f');
        if numel(numbers) == count
            values = numbers;
            return
        end
    end
end
end
