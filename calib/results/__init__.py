"""What the functions of `calib` return: frozen results that read finished files, with frames, figures and a summary."""
