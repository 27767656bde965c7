#include "photosphere/caches/cache_format.h"

#include <fmt/format.h>

#include <algorithm>

#include "byte_reader.h"
#include "columns.h"
#include "foreign_formats.h"
#include "photosphere/core/error.h"

namespace photosphere::caches {

namespace fs = std::filesystem;

namespace {

bool hasExtension(const CacheFormat& format, std::string_view extension) {
  return std::find(format.extensions.begin(), format.extensions.end(), extension) !=
         format.extensions.end();
}

/// `.ply, .csv, ..` of the formats that pass the filter.
template <class Filter>
std::string extensionList(Filter filter) {
  std::vector<std::string_view> extensions;
  for (const CacheFormat* format : cacheFormats())
    if (filter(*format))
      extensions.insert(extensions.end(), format->extensions.begin(), format->extensions.end());
  return fmt::format("{}", fmt::join(extensions, ", "));
}

[[noreturn]] void refuse(const std::string& path, const ForeignFormat& foreign) {
  throw InputError(path, fmt::format("is {}, which this version does not read; {}", foreign.name,
                                     foreign.advice));
}

}  // namespace

const CacheFormat& detectFormat(const fs::path& path) {
  FileReader file(path);
  std::string head(4096, '\0');
  std::size_t length = 0;
  while (length < head.size()) {
    const std::size_t got = file.readSome(head.data() + length, head.size() - length);
    if (got == 0) break;
    length += got;
  }
  head.resize(length);
  if (head.empty()) throw InputError(file.path(), "is empty (0 bytes); write it again");

  if (const ForeignFormat* foreign = foreignByContent(head)) refuse(file.path(), *foreign);
  for (const CacheFormat* format : cacheFormats())
    if (format->recognize && format->recognize(head)) return *format;
  const std::string extension = lowered(path.extension().string());
  for (const CacheFormat* format : cacheFormats()) {
    if (!hasExtension(*format, extension)) continue;
    if (!format->recognize) return *format;
    throw InputError(file.path(),
                     fmt::format("is named {} but does not begin like one: it is damaged "
                                 "or misnamed; write it again",
                                 extension));
  }
  if (const ForeignFormat* foreign = foreignByName(lowered(path.filename().string())))
    refuse(file.path(), *foreign);
  throw InputError(
      file.path(),
      fmt::format("is of no format that this version reads ({})",
                  extensionList([](const CacheFormat& f) { return f.read != nullptr; })));
}

const CacheFormat& formatForWriting(const fs::path& path) {
  const std::string extension = lowered(path.extension().string());
  for (const CacheFormat* format : cacheFormats())
    if (format->write && hasExtension(*format, extension)) return *format;
  throw ConfigError(fmt::format(
      "{}: cannot write '{}' files; choose one of {}", path.string(), extension,
      extensionList([](const CacheFormat& format) { return format.write != nullptr; })));
}

CacheContent readCache(const fs::path& path) {
  const CacheFormat& format = detectFormat(path);
  return format.read(path, ParamValues(format.params));
}

}  // namespace photosphere::caches
