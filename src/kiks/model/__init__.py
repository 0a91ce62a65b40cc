"""What an arena, a robot and a link are: frozen, checked, loaded and saved. Nothing here changes while time passes."""
