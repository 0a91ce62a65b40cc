"""The desk: a world in a browser, to see, touch and understand it."""
