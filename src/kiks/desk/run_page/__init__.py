"""The page to hand in: a recorded run as one HTML file that needs no network."""
