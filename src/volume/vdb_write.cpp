#include <fmt/format.h>
#include <openvdb/io/Archive.h>

#include <cerrno>
#include <fstream>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/core/output_file.h"
#include "photosphere/volume/vdb_file.h"
#include "vdb_walk.h"

namespace photosphere::volume {

namespace {

// io::File::write swallows write errors and io::Stream leaves out the offsets by which other
// software loads single grids. Both call this protected function of their base; with a stream that
// throws, it gives a file with offsets and loses no error.
class ArchiveWriter : public openvdb::io::Archive {
 public:
  using Archive::write;
  void writeTo(std::ostream& out, const openvdb::GridCPtrVec& grids, bool seekable,
               const openvdb::MetaMap& metadata) {
    setCompression(
        (hasBloscCompression() ? openvdb::io::COMPRESS_BLOSC : openvdb::io::COMPRESS_ZIP) |
        openvdb::io::COMPRESS_ACTIVE_MASK);
    Archive::write(out, grids, seekable, metadata);
  }
};

void writeTemporary(const OutputFile& file, const openvdb::GridCPtrVec& grids,
                    const openvdb::MetaMap& metadata) {
  errno = 0;
  try {
    std::ofstream out(file.temporaryPath(), std::ios::binary | std::ios::trunc);
    out.exceptions(std::ios::badbit | std::ios::failbit);
    ArchiveWriter().writeTo(out, grids, /*seekable=*/!file.inPlace(), metadata);
    out.flush();
    out.close();
  } catch (const std::ios_base::failure&) {
    throw OutputError(file.target().string(), "cannot be written: " + describeWriteError(errno));
  } catch (const openvdb::Exception& error) {
    throw OutputError(file.target().string(), fmt::format("OpenVDB: {}", error.what()));
  }
}

void checkWritten(const OutputFile& file, std::size_t gridCount) {
  try {
    const VdbContents contents = walkVdb(file.temporaryPath());
    const bool whole =
        static_cast<std::size_t>(contents.gridCount) == gridCount && contents.hasOffsets &&
        static_cast<std::uint64_t>(contents.grids.back().endPos) == contents.fileSize;
    if (!whole) throw OutputError(file.target().string(), "came back incomplete after writing");
  } catch (const InputError& error) {
    throw OutputError(file.target().string(),
                      fmt::format("came back damaged after writing ({})", error.what()));
  }
}

}  // namespace

void writeVdb(const std::filesystem::path& path, const std::vector<Grid>& grids,
              const std::map<std::string, std::string>& metadata) {
  if (grids.empty())
    throw OutputError(path.string(), "no grids to write; a .vdb without grids cannot be read");
  initializeOpenVdb();
  openvdb::GridCPtrVec pointers;
  for (const Grid& grid : grids) {
    if (!grid) throw OutputError(path.string(), "one of the grids to write is empty (no data)");
    pointers.push_back(grid.base());
  }
  openvdb::MetaMap fileMetadata;
  for (const auto& [key, value] : metadata)
    fileMetadata.insertMeta(key, openvdb::StringMetadata(value));
  OutputFile file(path);
  writeTemporary(file, pointers, fileMetadata);
  if (!file.inPlace()) checkWritten(file, grids.size());
  file.commit();
}

}  // namespace photosphere::volume
