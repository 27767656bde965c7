#pragma once
// Values that change over time: keys in place of a value of the scene file.

#include <map>
#include <string>
#include <vector>

#include "photosphere/core/param.h"

namespace photosphere::scene {

/// One key of a value.
struct Key {
  double frame = 0;
  std::vector<double> value;  ///< as a scene file writes it: a matrix row by row, a colour as three
};

/// Keys of one option: at least one, in the order of their frames, each frame once.
using Track = std::vector<Key>;

/// The keyed options of a table. The table's own value is that of the first key.
using Tracks = std::map<std::string, Track, std::less<>>;

/// True for types that keys can move: numbers, vectors, colours and matrices.
bool isKeyable(ParamType type);

/// The value at a time: linear between keys, held outside them. Of matrices the translation and the
/// stretch are linear and the rotation turns evenly over the shorter way (polar decomposition,
/// Shoemake & Duff 1992). Same bits on every CPU.
/// @param time  [frames]
std::vector<double> valueAt(ParamType type, const Track& track, double time);

/// What forbids keys of a matrix: one that no motion leads to. Empty when nothing does.
std::string matrixComplaint(const Track& track);

/// Sets the keyed options of a table to their values at a time. @throws ConfigError
void setToTime(const Tracks& tracks, double time, ParamValues& values, const std::string& where);

/// The numbers of a keyable value.
std::vector<double> numbersOf(const ParamValues& values, const Param& row);

/// Keys in scene-file syntax.
std::string formatTrack(const Param& row, const Track& track);

}  // namespace photosphere::scene
