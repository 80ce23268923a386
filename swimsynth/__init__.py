"""Sessions made with the twin, and their truth: swim trials, dry runs, free decays, tracking noise, motor logs."""
