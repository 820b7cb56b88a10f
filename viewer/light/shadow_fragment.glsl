// Shadow maps keep the depth alone.
void main() {}
