// Shadow maps hold only the depth.
void main() {}
