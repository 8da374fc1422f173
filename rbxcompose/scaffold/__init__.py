"""What `new` writes: answers become the texts of files, which are written to the disk, all or none."""
