double planned() { return 1.5; }
