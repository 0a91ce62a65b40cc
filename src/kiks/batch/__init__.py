"""Batches: many worlds at once, with the same bits as one robot on a wire."""
