"""Speed, cost, memory and accuracy, compared with other programs in the same run."""
