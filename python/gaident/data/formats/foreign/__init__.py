"""Log formats whose libraries may crash, hang or take all memory on a damaged file: each file is read in a process of its own."""
