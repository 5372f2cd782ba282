"""The folder of recordings: storage, lists, searches, descriptions, uploads and limits."""
