#pragma once
// Nuke's ASCII camera files, `.chan`.

#include <string>
#include <string_view>
#include <vector>

#include "photosphere/core/types.h"

namespace photosphere::cameras {

/// The camera of one line.
struct ChanKey {
  double frame = 0;
  Mat4d worldFromCamera{1.0};  ///< rigid; the camera looks along its -Z
  double verticalFov = 0;      ///< [degrees]; 0 where the file does not say
};

/// Reads text of lines `frame tx ty tz rx ry rz [vertical fov]`, in scene units and degrees.
/// Rotation order ZXY, Nuke's default for cameras: world from camera is Ry Rx Rz, roll first. Empty
/// lines and those that begin with # are skipped. The same in every locale.
/// @param name  stands for the file in messages
/// @return at least one key, in the order of their frames
/// @throws InputError naming the line: for what is no finite number, a wrong count of them, frames
///         that do not rise, a field of view outside (0, 180) degrees, or on some lines alone
std::vector<ChanKey> parseChan(std::string_view text, const std::string& name);

/// The same from a file of at most 64 MiB. @throws InputMissingError, InputError
std::vector<ChanKey> readChan(const std::string& path);

}  // namespace photosphere::cameras
