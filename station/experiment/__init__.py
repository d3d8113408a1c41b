"""Experiments: many flights for one question, answered by a table, figures and the numbers behind them."""
