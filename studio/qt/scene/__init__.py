"""The scene's tree and inspector."""
