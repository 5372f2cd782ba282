"""Worker threads of a session, for slow tasks: runs, comparisons, studies, exports."""
