"""Figures for print: one figure a function, vector files, the same palette as the reports'."""
