"""Results: figures, plots, tables, exports."""
