function values = kask(ref, request, prefix, count, tries)
% kask  Send a command, check its reply and return the numbers in it.
%
%   values = kask(ref, request, prefix, count, tries) sends request, up to so many times, until the reply is prefix and
%   count numbers. They are returned as a column, 0 if count is 0, and -1 if no try succeeds.

values = -1;
start = numel(prefix) + 1;
for attempt = 1:tries
    reply = kcmd(ref, request);
    if strncmp(reply, prefix, start - 1)
        numbers = sscanf(reply(start:end), ',%f');
        if count == 0
            if strcmp(reply, prefix)
                values = 0;
                return
            end
        elseif numel(numbers) == count
            values = numbers;
            return
        end
    end
end
end
