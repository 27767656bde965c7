#pragma once
// Which effects a frame simulates: the plain struct that a plan fills and everything below reads.

namespace photosphere {

struct Effects {
  bool emission = true;
  bool singleScattering = true;
  bool multipleScattering = true;
  bool shadows = true;
  bool chromatic =
      false;  ///< false: one channel is traced and stored, as lights and media are grey
  bool motionBlur = false;
  bool depthOfField = false;
  bool environment = false;
};

}  // namespace photosphere
