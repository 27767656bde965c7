#pragma once
// The options of [estimator] as a light field's layout, and named sets of them.

#include <string>

#include "photosphere/estimators/light_field.h"
#include "photosphere/scene/scene_file.h"

namespace photosphere::scene {

/// Fills what the preset names and the scene does not give, as if it were given: keys beside a
/// preset win over it. @throws ConfigError for an unknown preset
void applyPreset(ParamValues& estimator, const std::string& place);

/// What the options alone decide of a layout; smoke, lights and radii are filled in by setUpFrame.
/// Basis `auto` is the histogram where a light cache or an option of bins asks for one, else view.
estimators::LightFieldLayout layoutOf(const ParamValues& estimator, bool lightCache);

/// @throws ConfigError beginning with `place` for options that have no meaning together
void checkEstimator(const ParamValues& estimator, const std::string& place);

/// A layout in one line, for headers of files; options at their defaults are left out.
std::string describeLayout(const estimators::LightFieldLayout& layout);

}  // namespace photosphere::scene
