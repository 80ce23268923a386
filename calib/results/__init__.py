"""The results that functions of `calib` return: frozen, read from finished files, with tables, figures, a summary."""
