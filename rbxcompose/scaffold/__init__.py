"""What `new` writes: from answers to the texts of files, and those to the disk, all or none."""
