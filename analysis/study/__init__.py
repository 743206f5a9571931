"""What the numbers of many runs say: intervals over seeds, Pareto fronts with their knee, where a method breaks."""
