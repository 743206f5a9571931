"""What every part of the window uses: session, jobs, actions, theme."""
