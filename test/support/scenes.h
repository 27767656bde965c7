#pragma once
// Scenes from the smoke that ships with the project.

#include "support/frames.h"

namespace photosphere::test {

/// data/caches/column_0042.vdb, lit from the side (data/caches/README.md gives the look).
TestScene columnScene(int pixels);

}  // namespace photosphere::test
