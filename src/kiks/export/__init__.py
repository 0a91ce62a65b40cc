"""All that is derived from a recording: pictures, figures, films, tables, and the page to hand in."""
