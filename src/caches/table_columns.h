#pragma once
// Columns of a text table while they grow: integers until a cell proves otherwise.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "columns.h"
#include "photosphere/volume/particle_set.h"

namespace photosphere::caches {

/// The values of one attribute. A column is whole numbers until a cell is not one, and text only
/// when its first cell is; reals of at most nine digits each become float, which nine digits
/// identify.
class TableColumn {
 public:
  TableColumn(ColumnGroup group, bool text);

  const ColumnGroup& group() const { return m_group; }
  int arity() const { return static_cast<int>(m_group.columns.size()); }
  /// Stores a cell. Rows come in order, every component of a row before the next row.
  /// @return false when the cell is no number
  bool store(std::size_t row, int component, std::string_view cell);
  std::uint64_t emptyCells() const { return m_empty; }
  /// The column as an attribute of `rows` particles; the column is empty afterwards.
  volume::Attribute takeAttribute(std::size_t rows);
  /// The same for positions.
  std::vector<Vec3d> takePositions(std::size_t rows);

 private:
  void makeReal();
  void ensure(std::size_t values);

  enum class Kind { integer, real, text };
  ColumnGroup m_group;
  Kind m_kind = Kind::integer;
  std::vector<std::int64_t> m_integers;
  std::vector<double> m_reals;
  std::vector<std::string> m_texts;
  int m_digits = 0;
  std::uint64_t m_empty = 0;
};

}  // namespace photosphere::caches
