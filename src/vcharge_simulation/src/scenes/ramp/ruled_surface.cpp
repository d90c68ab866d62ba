#include "scenes/ramp/ruled_surface.h"

#include <algorithm>
#include <memory>
#include <vector>

namespace vcharge {

namespace {

constexpr double kInside_m = 0.02;

struct Line {
  Eigen::Vector3f high, low, normal;
};

std::vector<Line> linesOf(const RuledSurface& surface) {
  std::vector<Line> lines;
  for (int i = 0; i <= surface.cells; ++i) {
    const int before = std::max(0, i - 1);
    const int after = std::min(surface.cells, i + 1);
    const Eigen::Vector3d high = surface.high(i);
    const Eigen::Vector3d low = surface.low(i);
    const Eigen::Vector3d along =
        surface.high(after) + surface.low(after) - surface.high(before) - surface.low(before);
    lines.push_back(
        {high.cast<float>(), low.cast<float>(), along.cross(high - low).normalized().cast<float>()});
  }
  return lines;
}

}  // namespace

LitSurface addRuledSurface(const RuledSurface& surface, uint32_t material, TriangleMesh* mesh) {
  const auto lines = std::make_shared<const std::vector<Line>>(linesOf(surface));
  const auto first = static_cast<uint32_t>(mesh->vertices.size());
  const auto width_m = static_cast<float>(surface.width_m);
  const auto rows = static_cast<uint32_t>(surface.rows);
  for (size_t i = 0; i < lines->size(); ++i) {
    const Line& line = (*lines)[i];
    for (uint32_t row = 0; row < rows; ++row) {
      const Eigen::Vector3f down =
          static_cast<float>(row) / static_cast<float>(rows - 1) * (line.low - line.high);
      mesh->vertices.push_back({line.high + down, line.normal,
                                static_cast<float>(i) / static_cast<float>(surface.cells),
                                down.norm() / width_m, 1.0F});
      if (i > 0 && row > 0) {
        const uint32_t here = first + static_cast<uint32_t>(i) * rows + row;
        mesh->triangles.push_back({{here - rows, here, here - 1}, material});
        mesh->triangles.push_back({{here - rows, here - 1, here - rows - 1}, material});
      }
    }
  }
  const auto inside_u = static_cast<float>(kInside_m / surface.length_m);
  const auto point_at = [lines, width_m, inside_u](float u, float v) {
    const float at = std::clamp(u, inside_u, 1.0F - inside_u) * static_cast<float>(lines->size() - 1);
    const size_t i = std::min(static_cast<size_t>(at), lines->size() - 2);
    const float weight = at - static_cast<float>(i);
    const Line& a = (*lines)[i];
    const Line& b = (*lines)[i + 1];
    const Eigen::Vector3f high = a.high + weight * (b.high - a.high);
    const Eigen::Vector3f down = a.low + weight * (b.low - a.low) - high;
    const float length_m = down.norm();
    const auto inside_m = static_cast<float>(std::min<double>(kInside_m, 0.5 * length_m));
    const float along_m = std::clamp(v * width_m, inside_m, length_m - inside_m);
    return LitSurface::Point{high + along_m / std::max(1e-6F, length_m) * down,
                             (a.normal + weight * (b.normal - a.normal)).normalized()};
  };
  return {point_at, {surface.length_m, surface.width_m}, material};
}

}  // namespace vcharge
