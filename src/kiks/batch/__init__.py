"""Many worlds at once: what is asked of one robot on a wire, asked of ten thousand."""
