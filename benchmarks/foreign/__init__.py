"""Random sessions that nobody shaped: is every number of the program right, or flagged?"""
