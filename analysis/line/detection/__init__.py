"""Where a line may be: colour channel, noise, candidate peaks."""
