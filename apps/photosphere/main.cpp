#include "photosphere/cli/main.h"

int main(int argc, char** argv) {
  return photosphere::cli::run(argc, argv);
}
