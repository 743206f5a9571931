"""The Dataset workspace: a recipe of labelled images and its contact sheet."""
