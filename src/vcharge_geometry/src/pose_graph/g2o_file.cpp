#include "vcharge_geometry/pose_graph/g2o_file.h"

#include <cmath>
#include <sstream>

#include <Eigen/Eigenvalues>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

/// Rows of the 6x6 information matrix that a file of this dimension contains.
const std::vector<int>& informationRows(bool planar) {
  static const std::vector<int> planar_rows{0, 1, 5};
  static const std::vector<int> spatial_rows{0, 1, 2, 3, 4, 5};
  return planar ? planar_rows : spatial_rows;
}

/// Reads the fields of a line; every error names the file and the line.
class LineReader {
 public:
  LineReader(const std::string& path, int line_number, const std::string& line)
      : where_(path + ":" + std::to_string(line_number) + ": "), stream_(line) {}

  [[noreturn]] void fail(const std::string& reason) const { throw InputError(where_ + reason); }

  std::string tag() {
    std::string tag;
    stream_ >> tag;
    return tag;
  }
  int64_t node() {
    int64_t id = 0;
    if (!(stream_ >> id) || id < 0) {
      fail("expected the number of a node, 0 or more");
    }
    return id;
  }
  double number() {
    double value = 0.0;
    if (!(stream_ >> value) || !std::isfinite(value)) {
      fail("expected a finite number");
    }
    return value;
  }
  RigidTransform transform(bool planar) {
    if (planar) {
      const double x_m = number();
      const double y_m = number();
      return RigidTransform::planar(x_m, y_m, number());
    }
    Eigen::Vector3d translation_m;
    for (double& value : translation_m) {
      value = number();
    }
    Eigen::Vector4d xyzw;
    for (double& value : xyzw) {
      value = number();
    }
    const double norm = xyzw.norm();
    if (!(norm > 0.5 && norm < 2.0)) {
      fail("expected a unit quaternion x y z w");
    }
    return RigidTransform(Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]), translation_m);
  }
  Eigen::Matrix<double, 6, 6> information(bool planar) {
    Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
    const std::vector<int>& rows = informationRows(planar);
    for (size_t i = 0; i < rows.size(); ++i) {
      for (size_t j = i; j < rows.size(); ++j) {
        information(rows[i], rows[j]) = information(rows[j], rows[i]) = number();
      }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(information);
    if (!(eigen.eigenvalues()[0] >= -1e-9 * eigen.eigenvalues()[5])) {
      fail("expected a positive semidefinite information matrix");
    }
    return information;
  }
  void end() {
    std::string rest;
    if (stream_ >> rest) {
      fail("unexpected '" + rest + "'");
    }
  }

 private:
  std::string where_;
  std::istringstream stream_;
};

}  // namespace

PoseGraph readG2o(const std::string& path) {
  std::istringstream text(readTextFile(path));
  PoseGraph graph;
  bool dimension_known = false;
  std::string line;
  for (int line_number = 1; std::getline(text, line); ++line_number) {
    LineReader reader(path, line_number, line);
    const std::string tag = reader.tag();
    if (tag.empty() || tag[0] == '#' || tag == "FIX") {
      continue;
    }
    const bool planar = tag == "VERTEX_SE2" || tag == "EDGE_SE2";
    const bool vertex = tag == "VERTEX_SE2" || tag == "VERTEX_SE3:QUAT";
    if (!planar && !vertex && tag != "EDGE_SE3:QUAT") {
      reader.fail("unknown '" + tag + "': expected VERTEX_SE2, EDGE_SE2, VERTEX_SE3:QUAT or EDGE_SE3:QUAT");
    }
    if (dimension_known && planar != graph.planar) {
      reader.fail("SE2 and SE3 in one file");
    }
    dimension_known = true;
    graph.planar = planar;
    if (vertex) {
      const int64_t node = reader.node();
      if (!graph.map_from_node.emplace(node, reader.transform(planar)).second) {
        reader.fail("node " + std::to_string(node) + " is given twice");
      }
    } else {
      PoseGraphEdge edge;
      edge.first = reader.node();
      edge.second = reader.node();
      if (edge.first == edge.second) {
        reader.fail("an edge from a node to itself");
      }
      edge.first_from_second = reader.transform(planar);
      edge.information = reader.information(planar);
      graph.edges.push_back(edge);
    }
    reader.end();
  }
  if (graph.edges.empty()) {
    throw InputError(path + ": no edge");
  }
  PoseGraph placed = graph;
  if (!placeNodesAlongEdges(&placed)) {
    throw InputError(path + ": the edges do not connect all nodes");
  }
  graph.map_from_node.insert(placed.map_from_node.begin(), placed.map_from_node.end());
  return graph;
}

}  // namespace vcharge
