#include "light_voxels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "photosphere/core/rng.h"

namespace photosphere::scene {

namespace {

// Light is kept in voxels of two density voxels unless the scene says otherwise, or the smoke is
// few of them across, several mean free paths deep in each, or in clumps of their size: what light
// does inside a voxel is lost, up to a fifth of it. Finer ones take more time and memory, so that
// there is an end to it.
constexpr double kFewVoxels = 24;  // across the smoke, in the mean of three directions
constexpr double kThickVoxel = 8, kDeepVoxel = 4;  // optical depths
constexpr double kOpaqueVoxel = 64;                // the same, where light is lost
constexpr double kThickShare = 0.2;                // of the smoke's cells
constexpr double kClumps = 0.4;                    // excess density
constexpr double kFinestVoxel = 0.5;               // of a density voxel
constexpr std::uint64_t kMostFineBytes = 256 << 20;
// Coarser ones where they are many, and as many times those of the smoke: voxels much longer than
// wide, or smoke that goes far while the shutter is open.
constexpr double kManyVoxels = 1 << 20, kManyTimes = 16;
// Of a density voxel of the coarsest volume; more would tell next to nothing.
constexpr double kCoarsestVoxel = 64;
constexpr float kAlike = 0.3f;  // extinction of the thinnest channel over that of the densest

double lightVoxelEdge(const FrameSetup& setup) {
  return setup.layout.lightVoxel * setup.medium->voxelEdge();
}

// Whether much of the smoke is deeper than `depth` in each light voxel.
bool isDeep(const FrameSetup& setup, double depth) {
  const auto extinction = static_cast<float>(depth / lightVoxelEdge(setup));
  return setup.medium->majorants().shareAbove(extinction) > kThickShare;
}

// Extinction of the thinnest channel over that of the densest, in the volume where they differ
// most.
float thinnestChannel(const transport::Medium& medium) {
  float least = 1.0f;
  for (const transport::MediumVolume& volume : medium.volumes())
    if (!volume.density.empty() && volume.densityScale > 0)
      least = std::min({least, volume.tint.x, volume.tint.y, volume.tint.z});
  return least;
}

// @return whether there were too many, of which coarser ones are not
bool coarsenLightVoxels(FrameSetup& setup) {
  double voxels = setup.medium->majorants().cubesInside(lightVoxelEdge(setup));
  if (!(voxels > kManyVoxels)) return false;
  double own = 0, coarsest = 1;
  for (const transport::MediumVolume& volume : setup.medium->volumes()) {
    if (volume.density.empty() || !(volume.densityScale > 0)) continue;
    volume::forEachCell(volume.density, [&own](const Vec3i&, int, float) { ++own; });
    coarsest =
        std::max(coarsest, volume::finestSpacing(volume.localFromNode) / setup.medium->voxelEdge());
  }
  const double most = std::max(kManyVoxels, kManyTimes * own), usual = setup.layout.lightVoxel;
  double coarser = usual;
  for (; voxels > most && coarser < kCoarsestVoxel * coarsest; voxels /= 8)
    coarser *= 2;
  // Where none would do, too much is asked for, which is refused later.
  if (voxels > most || coarser == usual) return false;
  setup.layout.lightVoxel = coarser;
  setup.notes.push_back(fmt::format(
      "{}: light is stored in voxels of {} of the smallest edge of a density voxel, as finer ones "
      "are more than {} times as many as those of the smoke (estimator.light_voxel)",
      setup.medium->isMoving() ? "the smoke goes far while the shutter is open"
      : coarsest >= 2          ? "the voxels of one volume are much finer than those of another"
                               : "the smoke's voxels are much longer than wide",
      coarser, kManyTimes));
  return true;
}

// How much denser smoke is than within a light voxel around it, in the mean over the smoke: 0 where
// it is even, 0.1 in shipped simulations, 0.6 in a cloud of balls of two light voxels. Light that
// scatters in a clump is brighter there than in the gap beside it, which one voxel cannot tell
// apart.
double excessDensity(const transport::Medium& medium, double edge) {
  constexpr std::uint64_t kPlaces = 4096;
  const volume::MajorantGrid& cells = medium.majorants();
  const auto forEachFilled = [&cells](const auto& visit) {
    const Vec3i n = cells.dims();
    for (int z = 0; z < n.z; ++z)
      for (int y = 0; y < n.y; ++y)
        for (int x = 0; x < n.x; ++x)
          if (cells.majorant({x, y, z}) > 0) visit(Vec3i(x, y, z));
  };
  std::uint64_t filled = 0, cell = 0, place = 0;
  forEachFilled([&](const Vec3i&) { ++filled; });
  Rng rng(RandomKey::fromSeed(0, 0), RandomStream::visibility, 0);
  const auto apart = static_cast<float>(edge / 2);
  double excess = 0, all = 0;
  const auto look = [&](const Vec3f& p) {
    const float here = medium.extinction(p);
    if (!(here > 0)) return;
    float around = here;
    for (int corner = 0; corner < 8; ++corner)
      around += medium.extinction(
          p + apart * Vec3f(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1));
    excess += static_cast<double>(here * (here * 9 / around - 1));
    all += static_cast<double>(here);
  };
  forEachFilled([&](const Vec3i& at) {
    for (; place < kPlaces && place * filled / kPlaces == cell; ++place)
      look(Vec3f(medium.bounds().min) +
           (Vec3f(at) + Vec3f(rng.uniform(), rng.uniform(), rng.uniform())) * cells.cellSize());
    ++cell;
  });
  return all > 0 ? excess / all : 0;
}

}  // namespace

void chooseSmoothing(const ParamValues& e, FrameSetup& setup) {
  using namespace estimators;
  LightFieldLayout& l = setup.layout;
  if (e.text("type") != "photosphere" || e.given("smoothing") || !e.text("cache").empty() ||
      l.holdsPower() || setup.medium->bounds().empty() || !isDeep(setup, kThickVoxel))
    return;
  // Weights are those of the densest channel: what is seen of the others lies deeper.
  if (thinnestChannel(*setup.medium) < kAlike) {
    if (isDeep(setup, kOpaqueVoxel))
      setup.notes.push_back(
          "the smoke is opaque within each light voxel in its densest channel, and much thinner in "
          "another: of light scattered many times the densest is left less than there is (0.85 at "
          "150 mean free paths in a light voxel, 0.6 at 15,000); estimator.type = \"path_traced\" "
          "or \"light_traced\" has it all");
    return;
  }
  l.smoothing = Smoothing::visible;
  setup.notes.push_back(
      fmt::format("the smoke is many mean free paths deep in each light voxel: photons count by "
                  "what {} of them (estimator.smoothing = \"visible\")",
                  l.basis == Basis::view ? "the camera sees" : "is seen from all round"));
}

void chooseLightVoxel(const ParamValues& e, FrameSetup& setup) {
  using namespace estimators;
  LightFieldLayout& l = setup.layout;
  const transport::Medium& medium = *setup.medium;
  if (e.text("type") != "photosphere" || e.given("light_voxel") || !e.text("cache").empty() ||
      l.carrier != Carrier::voxels || medium.bounds().empty())
    return;
  if (coarsenLightVoxels(setup)) return;
  const Vec3d size = medium.bounds().extent();
  const double across = std::cbrt(size.x * size.y * size.z) / medium.voxelEdge();
  const double usual = l.lightVoxel;
  const double radius = e.real("radius") * setup.space.metersPerUnit;
  std::string_view why;
  while (l.lightVoxel > kFinestVoxel) {
    const bool few = across < kFewVoxels * l.lightVoxel;
    const bool deep = l.smoothing != Smoothing::visible && isDeep(setup, kDeepVoxel);
    if (!few && !deep && !(excessDensity(medium, lightVoxelEdge(setup)) > kClumps)) break;
    const double before = std::exchange(l.lightVoxel, 0.5 * l.lightVoxel);
    const double widest = kMostVoxelsWide * l.lightVoxel * medium.voxelEdge();
    if (radius > widest || predictedLightBytes(setup) > kMostFineBytes) {
      l.lightVoxel = before;
      break;
    }
    why = few    ? "few voxels across"
          : deep ? "several mean free paths deep in each voxel"
                 : "in clumps of about a light voxel";
  }
  if (l.lightVoxel < usual)
    setup.notes.push_back(
        fmt::format("the smoke is {}: light is stored in voxels of {} density voxel "
                    "(estimator.light_voxel)",
                    why, l.lightVoxel));
}

}  // namespace photosphere::scene
