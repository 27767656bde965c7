#pragma once
// Which scalar columns of a file make one particle attribute, and what to call them on writing.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace photosphere::caches {

/// Columns that form one attribute, in component order.
struct ColumnGroup {
  std::string name;                  ///< Houdini name; `P` for positions
  std::vector<std::size_t> columns;  ///< indices into the names given
};

/// Groups scalar columns: x y z to `P`, vx vy vz to `v`, nx ny nz to `N`, red green blue to `Cd`;
/// `name_0 name_1 ..`, `name.x name.y ..`, `name[0]`, `name:0` and repeated names to one attribute.
/// What is left becomes an attribute of one component. Group names are unique.
std::vector<ColumnGroup> groupColumns(const std::vector<std::string>& names);

/// The first name that columns of two groups share, or that an attribute of one number, such as
/// `pscale`, has twice; empty where there is none. Which of them is meant only the user knows.
std::string repeatedColumn(const std::vector<std::string>& names,
                           const std::vector<ColumnGroup>& groups);

/// The scalar column names that stand for an attribute, the inverse of groupColumns.
std::vector<std::string> columnNames(std::string_view attribute, int arity);

/// volume::houdiniName, and `N` for normals.
std::string attributeName(std::string_view name);

/// Lower-case ASCII copy.
std::string lowered(std::string_view text);

}  // namespace photosphere::caches
