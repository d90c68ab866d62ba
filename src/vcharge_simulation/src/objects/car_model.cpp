#include "vcharge_simulation/objects/car_model.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vcharge {

namespace {

constexpr int kNumProfilePoints = 12;
constexpr double kArchGap_m = 0.045;

double blend(double a, double b, double weight) {
  return a + (b - a) * weight;
}
double smoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

// Half a cross section, as an outline from the middle of the floor to the middle of the roof.
struct Section {
  double x;
  std::array<Eigen::Vector2d, kNumProfilePoints> points;  // (y, z), y >= 0
};

double beltHeight(const CarShape& shape, double x) {
  double z;
  if (x > shape.windscreen_base) {
    const double t = (shape.front() - x) / (shape.front() - shape.windscreen_base);
    z = blend(shape.bonnet_front, shape.bonnet_rear, std::sqrt(std::max(0.0, t)));
  } else {
    const double t = (shape.windscreen_base - x) / (shape.windscreen_base - shape.rear());
    z = blend(shape.bonnet_rear, shape.belt_rear, t);
  }
  const double to_end = std::min(shape.front() - x, x - shape.rear());
  return z - 0.10 * std::pow(1.0 - std::clamp(to_end / 0.15, 0.0, 1.0), 2.0);
}

double roofHeight(const CarShape& shape, double x) {
  const double belt = beltHeight(shape, x);
  double rise;
  if (x >= shape.roof_front) {
    rise = (shape.windscreen_base - x) / (shape.windscreen_base - shape.roof_front);
  } else if (x <= shape.roof_rear) {
    rise = (x - shape.rear_window_base) / std::max(0.02, shape.roof_rear - shape.rear_window_base);
  } else {
    rise = 1.0;
  }
  const double middle = 0.5 * (shape.roof_front + shape.roof_rear);
  const double bend = 2.0 * (x - middle) / (shape.roof_front - shape.roof_rear);
  const double roof = shape.height - 0.035 * std::min(1.0, bend * bend);
  return belt + (roof - belt) * std::pow(std::clamp(rise, 0.0, 1.0), 0.9);
}

double sillHeight(const CarShape& shape, double x) {
  double z = shape.sill;
  const double to_end = std::min(shape.front() - x, x - shape.rear());
  z += 0.08 * std::pow(1.0 - std::clamp(to_end / 0.3, 0.0, 1.0), 2.0);
  const double arch = shape.wheel_radius + kArchGap_m;
  for (const double axle : {0.0, shape.wheelbase}) {
    const double d = x - axle;
    if (std::abs(d) < arch) {
      z = std::max(z, shape.wheel_radius + std::sqrt(arch * arch - d * d));
    }
  }
  return z;
}

Section makeSection(const CarShape& shape, double x) {
  const double belt = beltHeight(shape, x);
  const double sill = sillHeight(shape, x);
  const double cabin_height = roofHeight(shape, x) - belt;
  const double cabin = smoothStep(cabin_height / 0.15);
  const double end = std::clamp(1.0 - std::min(shape.front() - x, x - shape.rear()) / 0.7, 0.0, 1.0);
  const double w = 0.5 * shape.width * (1.0 - 0.14 * end * end * end);
  const double body = belt - sill;
  const auto upper = [&](double y_flat, double z_flat, double y_cabin, double z_cabin) {
    return Eigen::Vector2d(w * blend(y_flat, y_cabin, cabin),
                           belt + blend(z_flat, std::max(z_flat, z_cabin * cabin_height), cabin));
  };
  Section section;
  section.x = x;
  section.points = {Eigen::Vector2d(0.0, sill),
                    Eigen::Vector2d(0.80 * w, sill),
                    Eigen::Vector2d(0.965 * w, sill + 0.02),
                    Eigen::Vector2d(w, sill + 0.30 * body),
                    Eigen::Vector2d(w, sill + 0.65 * body),
                    Eigen::Vector2d(0.985 * w, sill + 0.88 * body),
                    Eigen::Vector2d(0.95 * w, belt),
                    upper(0.85, 0.015, 0.925, 0.06),
                    upper(0.70, 0.03, 0.86, 0.55),
                    upper(0.50, 0.04, 0.76, 0.90),
                    upper(0.30, 0.045, 0.62, 0.985),
                    upper(0.0, 0.05, 0.0, 1.0)};
  return section;
}

std::vector<double> stationPositions(const CarShape& shape) {
  std::vector<double> xs;
  const double arch = shape.wheel_radius + kArchGap_m;
  for (const double axle : {0.0, shape.wheelbase}) {
    for (const double cosine :
         {-1.001, -0.999, -0.92, -0.75, -0.5, -0.2, 0.2, 0.5, 0.75, 0.92, 0.999, 1.001}) {
      xs.push_back(axle + arch * cosine);
    }
  }
  for (const double x : {shape.windscreen_base, shape.roof_front, shape.roof_rear, shape.rear_window_base}) {
    xs.push_back(x);
  }
  const double middle = 0.5 * (shape.roof_front + shape.roof_rear);
  for (const double offset : {-0.05, 0.05}) {
    xs.push_back(middle + offset);  // pillar between the doors
  }
  xs.push_back(shape.windscreen_base - 0.45);
  xs.push_back(shape.roof_rear + shape.rear_pillar);
  for (const double inset : {0.0, 0.02, 0.06, 0.13, 0.25, 0.45}) {
    xs.push_back(shape.front() - inset);
    xs.push_back(shape.rear() + inset);
  }
  for (double x = shape.rear() + 0.6; x < shape.front() - 0.5; x += 0.22) {
    xs.push_back(x);
  }
  std::sort(xs.begin(), xs.end());
  std::vector<double> distinct;
  for (const double x : xs) {
    if (x >= shape.rear() && x <= shape.front() && (distinct.empty() || x - distinct.back() > 5e-4)) {
      distinct.push_back(x);
    }
  }
  return distinct;
}

// Lofts the body from one closed ring of points per station; each ring runs from the floor over the left side
// and the roof back along the right side.
class BodyLoft {
 public:
  BodyLoft(const CarShape& shape, const CarMaterials& materials, TriangleMesh* mesh)
      : shape_(shape), materials_(materials), mesh_(mesh), xs_(stationPositions(shape)) {
    for (const double x : xs_) {
      const Section section = makeSection(shape, x);
      std::vector<Eigen::Vector3f> ring;
      for (int j = 0; j < kNumProfilePoints; ++j) {
        const Eigen::Vector2d& point = section.points[static_cast<size_t>(j)];
        ring.emplace_back(Eigen::Vector3d(x, point.x(), point.y()).cast<float>());
      }
      for (int j = kNumProfilePoints - 2; j > 0; --j) {
        const Eigen::Vector2d& point = section.points[static_cast<size_t>(j)];
        ring.emplace_back(Eigen::Vector3d(x, -point.x(), point.y()).cast<float>());
      }
      rings_.push_back(std::move(ring));
    }
  }

  void build() {
    const int n = static_cast<int>(rings_.front().size());
    for (size_t i = 0; i + 1 < rings_.size(); ++i) {
      for (int j = 0; j < n; ++j) {
        addPatch(i, j, (j + 1) % n);
      }
    }
    addCap(0, -1.0F);
    addCap(rings_.size() - 1, 1.0F);
  }

 private:
  const Eigen::Vector3f& point(size_t i, int j) const { return rings_[i][static_cast<size_t>(j)]; }

  Eigen::Vector3f normalAt(size_t i, int j) const {
    const int n = static_cast<int>(rings_.front().size());
    const size_t before = i > 0 ? i - 1 : i;
    const size_t after = std::min(i + 1, rings_.size() - 1);
    const Eigen::Vector3f along = point(after, j) - point(before, j);
    const Eigen::Vector3f around = point(i, (j + 1) % n) - point(i, (j + n - 1) % n);
    const Eigen::Vector3f normal = around.cross(along);
    return normal.norm() > 1e-9F ? Eigen::Vector3f(normal.normalized()) : Eigen::Vector3f::UnitZ();
  }

  // Index in the half profile of the lower end of the band between ring points j and j + 1.
  static int bandOf(int j) { return j < kNumProfilePoints - 1 ? j : 2 * kNumProfilePoints - 3 - j; }

  bool isSideGlass(double x) const {
    const double middle = 0.5 * (shape_.roof_front + shape_.roof_rear);
    return x < shape_.windscreen_base - 0.45 && x > shape_.roof_rear + shape_.rear_pillar &&
           std::abs(x - middle) > 0.05;
  }

  uint32_t materialOf(int band, double x, const Eigen::Vector3f& normal) const {
    if (band <= 1) {
      return materials_.trim;
    }
    if ((band == 7 || band == 8) && isSideGlass(x)) {
      return materials_.glass;
    }
    if (band >= 8) {
      const bool windscreen = x < shape_.windscreen_base && x > shape_.roof_front + 0.03;
      const bool rear_window = x > shape_.rear_window_base && x < shape_.roof_rear - 0.03;
      if ((windscreen || rear_window) && band >= (windscreen ? 8 : 9)) {
        return materials_.glass;
      }
    }
    if (normal.x() > 0.6F && band <= 7) {
      return materials_.front;
    }
    if (normal.x() < -0.6F) {
      return materials_.rear;
    }
    return band <= 6 && std::abs(normal.y()) > 0.6F ? materials_.side : materials_.paint;
  }

  void setTexture(uint32_t material, MeshVertex* vertex) const {
    const Eigen::Vector3f& p = vertex->position;
    vertex->v = 1.0F - p.z() / static_cast<float>(shape_.height);
    vertex->u = material == materials_.side
                    ? (p.x() - static_cast<float>(shape_.rear())) / static_cast<float>(shape_.length)
                    : 0.5F + p.y() / static_cast<float>(shape_.width);
  }

  void addPatch(size_t i, int j, int next_j) {
    const std::array<std::pair<size_t, int>, 4> corners = {
        {{i, j}, {i, next_j}, {i + 1, next_j}, {i + 1, j}}};
    const Eigen::Vector3f normal =
        (point(i, next_j) - point(i + 1, j)).cross(point(i + 1, next_j) - point(i, j));
    if (normal.norm() < 1e-9F) {
      return;
    }
    const uint32_t material = materialOf(bandOf(j), 0.5 * (xs_[i] + xs_[i + 1]), normal.normalized());
    const auto first = static_cast<uint32_t>(mesh_->vertices.size());
    for (const auto& [station, index] : corners) {
      MeshVertex vertex;
      vertex.position = point(station, index);
      vertex.normal = normalAt(station, index);
      setTexture(material, &vertex);
      mesh_->vertices.push_back(vertex);
    }
    mesh_->triangles.push_back({{first, first + 1, first + 2}, material});
    mesh_->triangles.push_back({{first, first + 2, first + 3}, material});
  }

  void addCap(size_t i, float direction) {
    const uint32_t material = direction > 0.0F ? materials_.front : materials_.rear;
    const auto first = static_cast<uint32_t>(mesh_->vertices.size());
    const std::vector<Eigen::Vector3f>& ring = rings_[i];
    MeshVertex vertex;
    vertex.normal = Eigen::Vector3f(direction, 0.0F, 0.0F);
    Eigen::Vector3f centre = Eigen::Vector3f::Zero();
    for (const Eigen::Vector3f& p : ring) {
      centre += p / static_cast<float>(ring.size());
    }
    vertex.position = centre + Eigen::Vector3f(0.015F * direction, 0.0F, 0.0F);
    setTexture(material, &vertex);
    mesh_->vertices.push_back(vertex);
    for (const Eigen::Vector3f& p : ring) {
      vertex.position = p;
      setTexture(material, &vertex);
      mesh_->vertices.push_back(vertex);
    }
    const auto n = static_cast<uint32_t>(ring.size());
    for (uint32_t j = 0; j < n; ++j) {
      mesh_->triangles.push_back({{first, first + 1 + j, first + 1 + (j + 1) % n}, material});
    }
  }

  const CarShape& shape_;
  const CarMaterials& materials_;
  TriangleMesh* mesh_;
  std::vector<double> xs_;
  std::vector<std::vector<Eigen::Vector3f>> rings_;
};

void addWheels(const CarShape& shape, const CarMaterials& materials, TriangleMesh* mesh) {
  const auto radius = static_cast<float>(shape.wheel_radius);
  for (const double axle : {0.0, shape.wheelbase}) {
    for (const float side : {-1.0F, 1.0F}) {
      const float outer = side * static_cast<float>(0.5 * shape.width - 0.015);
      const Eigen::Vector3f outside(static_cast<float>(axle), outer, radius);
      const Eigen::Vector3f inside(static_cast<float>(axle), outer - 0.2F * side, radius);
      addFrustum(inside, outside, radius, radius, 20, true, materials.tyre, mesh);
      addFrustum(outside - Eigen::Vector3f(0, 0.01F * side, 0),
                 outside + Eigen::Vector3f(0, 0.012F * side, 0), radius * 0.98F, radius * 0.93F, 20, true,
                 materials.wheel, mesh);
    }
  }
}

void addMirrorsAndPlates(const CarShape& shape, const CarMaterials& materials, TriangleMesh* mesh) {
  for (const double side : {-1.0, 1.0}) {
    Eigen::Isometry3f pose = placement(shape.windscreen_base - 0.35, side * (0.5 * shape.width + 0.07),
                                       shape.bonnet_rear + 0.08, 0.2 * side);
    addBox(pose, {0.12F, 0.2F, 0.14F}, materials.paint, mesh);
  }
  const auto half = 0.26F;
  for (const float end : {-1.0F, 1.0F}) {
    const auto x = static_cast<float>(end > 0.0F ? shape.front() + 0.02 : shape.rear() - 0.02);
    const float low = end > 0.0F ? 0.36F : 0.42F;
    const Eigen::Vector3f right(0.0F, end * half, 0.0F);
    const Eigen::Vector3f up(0.0F, 0.0F, 0.11F);
    const Eigen::Vector3f corner = Eigen::Vector3f(x, 0.0F, low) - right;
    addQuad(corner, corner + 2.0F * right, corner + 2.0F * right + up, corner + up, materials.plate, mesh);
  }
}

}  // namespace

const std::vector<CarShape>& carShapes() {
  // In the order of the fields of CarShape.
  static const std::vector<CarShape> shapes = {
      {"hatchback", 4.2, 1.77, 1.48, 2.58, 0.88, 0.31, 0.2, 0.68, 0.93, 0.98, 2.15, 1.45, -0.35, -0.68, 0.25},
      {"saloon", 4.65, 1.77, 1.43, 2.75, 0.9, 0.31, 0.2, 0.68, 0.93, 0.98, 2.25, 1.5, 0.1, -0.5, 0.25},
      {"estate", 4.65, 1.77, 1.47, 2.75, 0.9, 0.31, 0.2, 0.68, 0.93, 0.98, 2.25, 1.5, -0.65, -0.95, 0.25},
      {"van", 4.6, 1.85, 1.9, 2.9, 0.9, 0.31, 0.2, 0.85, 1.1, 1.12, 2.95, 2.2, -0.65, -0.76, 0.25},
      {"small", 3.55, 1.64, 1.48, 2.35, 0.7, 0.28, 0.2, 0.68, 0.93, 0.98, 2.1, 1.4, -0.15, -0.42, 0.25},
      {"off-roader", 4.5, 1.86, 1.68, 2.65, 0.92, 0.36, 0.3, 0.88, 1.08, 1.12, 2.15, 1.45, -0.5, -0.78,
       0.25}};
  return shapes;
}

TriangleMesh makeCarMesh(const CarShape& shape, const CarMaterials& materials, bool with_mirrors_and_plates) {
  TriangleMesh mesh;
  BodyLoft(shape, materials, &mesh).build();
  addWheels(shape, materials, &mesh);
  if (with_mirrors_and_plates) {
    addMirrorsAndPlates(shape, materials, &mesh);
  }
  return mesh;
}

}  // namespace vcharge
