#include "support/slab_table.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {

const std::vector<SlabRow>& slabTable() {
  static const std::vector<SlabRow> rows = [] {
    std::vector<SlabRow> read;
    std::ifstream in(projectFile("data/reference/slab.csv"));
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
      std::stringstream fields(line);
      std::string f[7];
      for (std::string& field : f)
        std::getline(fields, field, ',');
      read.push_back({f[0], std::stod(f[1]), std::stod(f[2]), std::stod(f[3]), f[4],
                      f[5].empty() ? 0.0 : std::stod(f[5]), std::stod(f[6])});
    }
    return read;
  }();
  return rows;
}

double slabValue(const std::string& illumination, double tau, double albedo, double g,
                 const std::string& quantity) {
  for (const SlabRow& row : slabTable())
    if (row.illumination == illumination && row.tau == tau && row.albedo == albedo && row.g == g &&
        row.quantity == quantity)
      return row.value;
  ADD_FAILURE() << "no row for " << illumination << ' ' << tau << ' ' << albedo << ' ' << g << ' '
                << quantity;
  return 0;
}

transport::Medium slabMedium(double tau, double albedo, double g) {
  const double width = 2 * (4 * tau + 30);
  return makeMedium(boxVolume({width, width, tau}, {32, 32, 8}, {albedo, g, 1.0}));
}

}  // namespace photosphere::test
