"""Reading and writing of files: archives, snapshots, locks, input from outside."""
