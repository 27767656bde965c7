#include "table_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "text_number.h"

namespace photosphere::caches {

namespace {

constexpr int kFloatDigits = 9;

/// Significant digits of a number's text.
int digitCount(std::string_view word) {
  int digits = 0;
  for (const char c : word) {
    if (c == 'e' || c == 'E') break;
    if (c >= '0' && c <= '9' && (digits > 0 || c != '0')) ++digits;
  }
  return digits;
}

template <class To, class From>
std::vector<To> narrowed(std::vector<From>& values) {
  std::vector<To> result;
  result.reserve(values.size());
  for (const From value : values)
    result.push_back(static_cast<To>(value));
  std::vector<From>().swap(values);
  return result;
}

}  // namespace

TableColumn::TableColumn(ColumnGroup group, bool text) : m_group(std::move(group)) {
  if (text) m_kind = Kind::text;
  if (m_group.name == "P") m_kind = Kind::real;
}

void TableColumn::ensure(std::size_t values) {
  const auto grow = [values](auto& column) {
    if (column.size() < values)
      column.resize(std::max(values, column.size() + column.size() / 2 + 1024));
  };
  if (m_kind == Kind::integer) grow(m_integers);
  if (m_kind == Kind::real) grow(m_reals);
  if (m_kind == Kind::text) grow(m_texts);
}

void TableColumn::makeReal() {
  m_kind = Kind::real;
  m_reals = narrowed<double>(m_integers);
}

bool TableColumn::store(std::size_t row, int component, std::string_view cell) {
  const std::size_t at = row * m_group.columns.size() + static_cast<std::size_t>(component);
  ensure(at + 1);
  if (m_kind == Kind::text) {
    m_texts[at] = cell;
    return true;
  }
  if (cell.empty()) {
    ++m_empty;
    if (m_kind == Kind::integer) makeReal();
    ensure(at + 1);
    m_reals[at] = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  if (m_digits <= kFloatDigits) m_digits = std::max(m_digits, digitCount(cell));
  if (m_kind == Kind::integer) {
    if (parseInteger(cell, m_integers[at])) return true;
    makeReal();
    ensure(at + 1);
  }
  return parseReal(cell, m_reals[at]);
}

namespace {

// Whether no value is too large for a float, or so small that it would lose digits.
bool fitFloat(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) {
    const double size = std::abs(v);
    return !(size < std::numeric_limits<float>::min() && size > 0) &&
           !(size > std::numeric_limits<float>::max() && std::isfinite(size));
  });
}

}  // namespace

volume::Attribute TableColumn::takeAttribute(std::size_t rows) {
  const std::size_t values = rows * m_group.columns.size();
  ensure(values);
  volume::Attribute attribute{m_group.name, arity(), {}};
  m_integers.resize(m_kind == Kind::integer ? values : 0);
  m_reals.resize(m_kind == Kind::real ? values : 0);
  m_texts.resize(m_kind == Kind::text ? values : 0);
  if (m_kind == Kind::text) {
    attribute.data = std::move(m_texts);
  } else if (m_kind == Kind::real) {
    if (m_digits <= kFloatDigits && fitFloat(m_reals))
      attribute.data = narrowed<float>(m_reals);
    else
      attribute.data = std::move(m_reals);
  } else if (std::all_of(m_integers.begin(), m_integers.end(), [](std::int64_t value) {
               return value >= INT32_MIN && value <= INT32_MAX;
             })) {
    attribute.data = narrowed<std::int32_t>(m_integers);
  } else {
    attribute.data = std::move(m_integers);
  }
  return attribute;
}

std::vector<Vec3d> TableColumn::takePositions(std::size_t rows) {
  std::vector<Vec3d> positions(rows);
  for (std::size_t i = 0; i < rows; ++i)
    positions[i] = Vec3d(m_reals[3 * i], m_reals[3 * i + 1], m_reals[3 * i + 2]);
  std::vector<double>().swap(m_reals);
  return positions;
}

}  // namespace photosphere::caches
