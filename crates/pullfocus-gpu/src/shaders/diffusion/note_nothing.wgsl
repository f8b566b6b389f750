fn note(value: Lane) {}
