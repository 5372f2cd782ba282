"""What takes too long to wait for, done in threads: runs, comparisons, studies, exports."""
