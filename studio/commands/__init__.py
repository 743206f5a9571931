"""What the commands of main.py do, and what they print."""
