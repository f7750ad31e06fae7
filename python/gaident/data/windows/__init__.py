"""Windows of long records, which know where they lie."""
