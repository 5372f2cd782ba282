"""Speed, cost, memory and accuracy, measured beside a peer in the same run."""
