#include "environment_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photosphere/core/error.h"
#include "photosphere/core/fast_math.h"
#include "trigonometry.h"

namespace photosphere::lights {

namespace {

float usable(float value) {
  return std::isfinite(value) && value > 0.0f ? value : 0.0f;
}

bool isInvalid(float value) {
  return !std::isfinite(value) || value < 0.0f;
}

// @return whether the pixel is invalid, and is counted
bool count(const Rgb& pixel, InvalidPixels& found) {
  float worst = 0.0f;
  for (int c = 0; c < 3; ++c) {
    const bool worse = std::isnan(pixel[c]) || (!std::isnan(worst) && !std::isinf(worst));
    if (isInvalid(pixel[c]) && worse) worst = pixel[c];
  }
  if (!isInvalid(worst)) return false;
  if (found.total() == 0) found.firstValue = worst;
  ++(std::isnan(worst) ? found.nans : std::isinf(worst) ? found.infinities : found.negatives);
  return true;
}

}  // namespace

std::string InvalidPixels::text() const {
  return fmt::format("{} NaN, {} infinite and {} negative pixels, the first ({}) at ({}, {})", nans,
                     infinities, negatives, firstValue, first.x, first.y);
}

void EnvironmentMap::readPixels(const image::Image& image, const Rgb& scale) {
  const auto red = image.channel("R"), green = image.channel("G"), blue = image.channel("B");
  const image::Window &data = image.dataWindow(), &whole = image.displayWindow();
  const image::Window both = image::intersection(data, whole);
  const auto width = static_cast<std::size_t>(m_width);
  m_pixels.assign(width * static_cast<std::size_t>(m_height), Rgb(0.0f));
  for (int y = both.y; y < both.y + both.height; ++y)
    for (int x = both.x; x < both.x + both.width; ++x) {
      const std::size_t from =
          static_cast<std::size_t>(y - data.y) * static_cast<std::size_t>(data.width) +
          static_cast<std::size_t>(x - data.x);
      const Vec2i at(x - whole.x, y - whole.y);
      if (count({red[from], green[from], blue[from]}, m_invalid) && m_invalid.total() == 1)
        m_invalid.first = {at.x, at.y};
      Rgb& p = m_pixels[static_cast<std::size_t>(at.y) * width + static_cast<std::size_t>(at.x)];
      p = scale * Rgb(usable(red[from]), usable(green[from]), usable(blue[from]));
      m_brightest = std::max(m_brightest, maxComponent(p));
      m_grey = m_grey && p.r == p.g && p.g == p.b;
    }
}

EnvironmentMap::EnvironmentMap(const image::Image& image, const Rgb& scale)
    : m_width(image.displayWindow().width), m_height(image.displayWindow().height) {
  readPixels(image, scale);
  for (int y = 0; y <= m_height; ++y)
    m_latitudes.push_back(1.0 - oneMinusCos(kPi * y / m_height));
  // A pixel weighs what the brightest of those around it does, since radiance is read between them:
  // where there is light, there is density.
  m_columns.resize(m_pixels.size());
  Vec3d integral(0.0);
  for (int y = 0; y < m_height; ++y) {
    const double bandOverPixels =
        (m_latitudes[static_cast<std::size_t>(y)] - m_latitudes[static_cast<std::size_t>(y) + 1]) *
        2 * kPi / m_width;
    double sum = 0;
    for (int x = 0; x < m_width; ++x) {
      float most = 0.0f;
      for (int v = -1; v <= 1; ++v)
        for (int u = -1; u <= 1; ++u)
          most = std::max(most, meanComponent(pixel(x + u, y + v)));
      sum += static_cast<double>(most);
      m_columns[static_cast<std::size_t>(y) * static_cast<std::size_t>(m_width) +
                static_cast<std::size_t>(x)] = static_cast<float>(sum);
      integral += Vec3d(pixel(x, y)) * bandOverPixels;
    }
    if (!(sum <= static_cast<double>(std::numeric_limits<float>::max())))
      throw ConfigError(fmt::format(
          "the pixels of row {} (channels up to {:.3g} W m^-2 sr^-1) add up to more than a float "
          "holds; lower the light's intensity",
          y, m_brightest));
    m_total += sum * bandOverPixels;
    m_rows.push_back(m_total);
  }
  m_integral = Rgb(integral);
}

void EnvironmentMap::addContent(Hasher& hasher) const {
  hasher.number(m_width);
  hasher.number(m_height);
  for (const Rgb& p : m_pixels)
    hasher.numbers(&p.x, 3);
}

// Around the sides; over a pole to the other side of it.
Rgb EnvironmentMap::pixel(int x, int y) const {
  if (y < 0 || y >= m_height) {
    y = std::clamp(y < 0 ? -1 - y : 2 * m_height - 1 - y, 0, m_height - 1);
    x += m_width / 2;
  }
  x = (x % m_width + m_width) % m_width;
  return m_pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(m_width) +
                  static_cast<std::size_t>(x)];
}

// x, y in pixels from the upper left corner.
Rgb EnvironmentMap::between(double x, double y) const {
  const double column = std::floor(x - 0.5), row = std::floor(y - 0.5);
  const auto fx = static_cast<float>(x - 0.5 - column), fy = static_cast<float>(y - 0.5 - row);
  const int i = static_cast<int>(column), j = static_cast<int>(row);
  return (1 - fy) * ((1 - fx) * pixel(i, j) + fx * pixel(i + 1, j)) +
         fy * ((1 - fx) * pixel(i, j + 1) + fx * pixel(i + 1, j + 1));
}

Rgb EnvironmentMap::radiance(const Vec3f& toward) const {
  const Vec3d w(toward);
  const double latitude = std::acos(glm::clamp(w.y, -1.0, 1.0)) / kPi;
  const double longitude = std::atan2(w.x, w.z) / (2 * kPi);
  return between((0.5 - longitude) * m_width, latitude * m_height);
}

EnvironmentMap::Sample EnvironmentMap::sample(const Vec2f& u) const {
  Sample out;
  if (!(m_total > 0)) return out;
  const double wanted = static_cast<double>(u.y) * m_total;
  auto row = static_cast<std::size_t>(std::upper_bound(m_rows.begin(), m_rows.end(), wanted) -
                                      m_rows.begin());
  row = std::min(row, m_rows.size() - 1);
  const double before = row > 0 ? m_rows[row - 1] : 0.0, band = m_rows[row] - before;
  const auto width = static_cast<std::size_t>(m_width);
  const float* columns = m_columns.data() + row * width;
  const float along = u.x * columns[width - 1];
  auto column =
      static_cast<std::size_t>(std::upper_bound(columns, columns + width, along) - columns);
  column = std::min(column, width - 1);
  const float left = column > 0 ? columns[column - 1] : 0.0f;
  const float weight = columns[column] - left;
  if (!(weight > 0.0f) || !(band > 0)) return out;
  // Even over the solid angle of the pixel: in the cosine from +Y, and in longitude.
  const double inRow = glm::clamp((wanted - before) / band, 0.0, 1.0);
  const double inColumn = static_cast<double>(glm::clamp((along - left) / weight, 0.0f, 1.0f));
  const double top = m_latitudes[row], bottom = m_latitudes[row + 1];
  const double cosine = top + (bottom - top) * inRow;
  const double turns = (static_cast<double>(column) + inColumn) / m_width;
  const double sine = std::sqrt(std::max(0.0, (1 - cosine) * (1 + cosine)));
  // The middle of the picture is +Z, its left +X: longitude falls from half a turn to minus half.
  const SinCos longitude = fastSinCosTurns(static_cast<float>(turns));
  out.toward = glm::normalize(Vec3f(Vec3d(sine * static_cast<double>(longitude.sin), cosine,
                                          -sine * static_cast<double>(longitude.cos))));
  const double y = (static_cast<double>(row) + 0.5);
  const double angle = exactAcos(cosine) / kPi * m_height;
  out.radiance = between(turns * m_width, std::clamp(angle, y - 0.5, y + 0.5));
  out.density = static_cast<float>(static_cast<double>(weight) / m_total);
  return out;
}

}  // namespace photosphere::lights
