// Format of a serialized vocabulary, little-endian:
//   8 bytes "VCHVOCAB", int32 version, descriptor type (0 CV_8UC1, 1 CV_32FC1), columns, nodes, words;
//   per node int32 first child, number of children, word; the centres row by row; float weight per word;
//   32 hexadecimal digits: XXH3-128 of all preceding bytes.
#include <cmath>
#include <cstring>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_features/vocabulary_tree.h"

namespace vcharge {
namespace {

constexpr char kMagic[] = "VCHVOCAB";
constexpr size_t kMagicSize = 8;
constexpr int32_t kVersion = 1;
constexpr size_t kHashSize = 32;
constexpr size_t kHeaderSize = kMagicSize + 5 * sizeof(int32_t);

void append(const void* data, size_t size, std::string* text) {
  text->append(static_cast<const char*>(data), size);
}

void append(int32_t value, std::string* text) {
  append(&value, sizeof(value), text);
}

class Reader {
 public:
  explicit Reader(const std::string& text) : text_(text) {}
  void read(void* data, size_t size) {
    std::memcpy(data, text_.data() + position_, size);
    position_ += size;
  }
  int32_t readInt() {
    int32_t value;
    read(&value, sizeof(value));
    return value;
  }
  void skip(size_t size) { position_ += size; }

 private:
  const std::string& text_;
  size_t position_ = 0;
};

std::string hashOf(const std::string& text, size_t size) {
  ContentHasher hasher;
  hasher.addBytes(text.data(), size);
  return hasher.hex();
}

}  // namespace

std::string VocabularyTree::serialize() const {
  std::string text(kMagic, kMagicSize);
  append(kVersion, &text);
  append(centres_.type() == CV_8UC1 ? 0 : 1, &text);
  append(centres_.cols, &text);
  append(static_cast<int32_t>(nodes_.size()), &text);
  append(numWords(), &text);
  for (const Node& node : nodes_) {
    append(node.first_child, &text);
    append(node.num_children, &text);
    append(node.word, &text);
  }
  for (int i = 0; i < centres_.rows; ++i) {
    append(centres_.ptr(i), centres_.cols * centres_.elemSize(), &text);
  }
  append(word_weights_.data(), word_weights_.size() * sizeof(float), &text);
  return text + hashOf(text, text.size());
}

void VocabularyTree::write(const std::string& path) const {
  writeTextFileAtomically(path, serialize());
}

VocabularyTree VocabularyTree::read(const std::string& path) {
  return parse(readTextFile(path), path);
}

VocabularyTree VocabularyTree::parse(const std::string& text, const std::string& source) {
  const auto require = [&](bool condition, const std::string& message) {
    if (!condition) {
      throw InputError(source + ": " + message);
    }
  };
  require(text.compare(0, kMagicSize, kMagic) == 0, "expected a vocabulary, found other bytes at its start");
  require(text.size() >= kHeaderSize + kHashSize, "vocabulary is truncated");
  Reader reader(text);
  reader.skip(kMagicSize);
  const int32_t version = reader.readInt();
  require(version == kVersion, "expected a vocabulary of version " + std::to_string(kVersion) + ", got " +
                                   std::to_string(version));
  const int32_t kind = reader.readInt();
  const int32_t columns = reader.readInt();
  const int32_t num_nodes = reader.readInt();
  const int32_t num_words = reader.readInt();
  require((kind == 0 && columns == 32) || (kind == 1 && columns >= 1 && columns <= 65536),
          "vocabulary is corrupt: bad kind of descriptors");
  require(num_nodes >= 1 && num_words >= 1 && num_words <= num_nodes,
          "vocabulary is corrupt: bad number of nodes or words");
  const size_t row_size = static_cast<size_t>(columns) * (kind == 0 ? 1 : sizeof(float));
  const size_t expected = kHeaderSize + static_cast<size_t>(num_nodes) * (3 * sizeof(int32_t) + row_size) +
                          static_cast<size_t>(num_words) * sizeof(float) + kHashSize;
  require(text.size() >= expected, "vocabulary is truncated: expected " + std::to_string(expected) +
                                       " bytes, got " + std::to_string(text.size()));
  require(text.size() == expected && text.substr(expected - kHashSize) == hashOf(text, expected - kHashSize),
          "vocabulary is corrupt: wrong checksum");
  VocabularyTree tree;
  tree.nodes_.resize(static_cast<size_t>(num_nodes));
  for (Node& node : tree.nodes_) {
    node.first_child = reader.readInt();
    node.num_children = reader.readInt();
    node.word = reader.readInt();
  }
  tree.centres_.create(num_nodes, columns, kind == 0 ? CV_8UC1 : CV_32FC1);
  for (int i = 0; i < num_nodes; ++i) {
    reader.read(tree.centres_.ptr(i), row_size);
  }
  tree.word_weights_.resize(static_cast<size_t>(num_words));
  reader.read(tree.word_weights_.data(), tree.word_weights_.size() * sizeof(float));
  require(tree.isValid(), "vocabulary is corrupt: its nodes are not a tree, or numbers are not finite");
  return tree;
}

bool VocabularyTree::isValid() const {
  int64_t next_child = 1;
  int32_t next_word = 0;
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    const bool leaf = node.num_children == 0;
    // Children are in the order of their parents: every node except the root has one parent before it.
    const bool right = leaf ? node.word == next_word
                            : node.word == -1 && node.num_children > 0 && node.first_child == next_child &&
                                  node.first_child > static_cast<int64_t>(i);
    if (!right) {
      return false;
    }
    next_child += node.num_children;
    next_word += leaf ? 1 : 0;
  }
  bool weights_valid = true;
  for (const float weight : word_weights_) {
    weights_valid = weights_valid && std::isfinite(weight) && weight >= 0.0F;
  }
  return next_child == static_cast<int64_t>(nodes_.size()) && next_word == numWords() && weights_valid &&
         cv::checkRange(centres_);
}

}  // namespace vcharge
