#include "check.hpp"

int main(int argc, char** argv) { return check::run(std::vector<std::string>(argv + 1, argv + argc)); }
