// SPDX-License-Identifier: Apache-2.0
// Rows of plain numbers in text, as most recordings are: exact to the last bit, and faster than a general
// reader.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <locale>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "module.hpp"

namespace nb = nanobind;

namespace needleforce::python {

namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t max_number_chars = 64;

/// A number at the start of `text`; how many characters it has, 0 if there is none or it is no double.
std::size_t parse(std::string_view text, double& value) {
#if defined(__cpp_lib_to_chars) && __cpp_lib_to_chars >= 201611L
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() ? static_cast<std::size_t>(end - text.data()) : 0;
#else  // a library without conversions of double
  const std::size_t size = std::min(text.find_first_not_of("0123456789+-.eE"), text.size());
  std::istringstream stream(std::string(text.substr(0, std::min(size, max_number_chars))));
  stream.imbue(std::locale::classic());
  return stream >> value ? (stream.eof() ? size : static_cast<std::size_t>(stream.tellg())) : 0;
#endif
}

/// How rows are written: what separates cells (0 for blanks and tabs), the decimal sign, the words for no
/// value, and which cells of a row are numbers.
struct RowFormat {
  char delimiter, decimal;
  std::vector<std::string> words;
  std::vector<bool> used;
};

/// What the numbers of a column look like: whole ones below 1000, those that may have a sign of thousands,
/// others. With the first two and no other the sign before three digits may be one of thousands.
enum Looks : std::uint8_t { whole = 1, grouped = 2, other = 4 };

Looks looks_of(std::string_view number) {
  if (!number.empty() && (number[0] == '-' || number[0] == '+')) number.remove_prefix(1);
  const std::size_t digits = std::min(number.find_first_not_of("0123456789"), number.size());
  if (digits == 0 || digits > 3) return other;
  if (digits == number.size()) return whole;
  const bool three =
      number.size() == digits + 4 && number.find_first_not_of("0123456789", digits + 1) == number.npos;
  return number[digits] == '.' && three && number[0] != '0' ? grouped : other;
}

/// Reads rows into columns of equal length. Text has to end with a character that ends a line.
class RowReader {
 public:
  RowReader(const RowFormat& format, std::string_view text)
      : looks(format.used.size()), format_(format), at_(text.data()), end_(text.data() + text.size()) {}

  /// The next row; false if it is not one of numbers, or has more cells than the one before. Cells that a
  /// short row lacks are missing: only the last rows may be short, as of a group of columns that ends before
  /// another.
  bool read(double* out, std::size_t stride) {
    const std::size_t size = format_.used.size();
    std::size_t cells = size;
    for (std::size_t k = 0; k < size; ++k) {
      if (k > 0 && ends_line()) cells = std::min(cells, k);
      if (k > 0 && format_.delimiter != 0 && !ends_line()) ++at_;  // a cell ends at a delimiter
      skip_blanks();
      double value = missing;
      column_ = k;
      if (!ends_line() && !(format_.used[k] ? cell(value) : skip_text())) return false;
      if (!format_.used[k]) continue;
      *out = value;
      out += stride;
    }
    const bool longer = short_rows > 0 && cells == size;
    short_rows += cells < size;
    return ends_line() && !longer;
  }

  /// Goes to the next line that is not blank; false at the end of the text.
  bool next_line() {
    skip_blanks();
    while (at_ < end_ && ends_line()) {
      ++at_;
      skip_blanks();
    }
    return at_ < end_;
  }

  std::size_t short_rows = 0;
  std::vector<std::uint8_t> looks;

 private:
  bool ends_line() const { return at_ == end_ || *at_ == '\n' || *at_ == '\r'; }
  bool is_blank() const { return *at_ == ' ' || (format_.delimiter == 0 && *at_ == '\t'); }
  bool ends_cell() const {
    return ends_line() || (format_.delimiter != 0 ? *at_ == format_.delimiter : is_blank());
  }

  void skip_blanks() {
    while (at_ < end_ && is_blank()) ++at_;
  }

  /// A number, a word for no value, or nothing; false for anything else.
  bool cell(double& value) {
    if (ends_cell()) return true;
    const bool quoted = *at_ == '"';
    at_ += quoted;
    if (!number(value) && !word(quoted)) return false;
    if (quoted && (at_ == end_ || *at_++ != '"')) return false;
    skip_blanks();
    return format_.delimiter == 0 || ends_cell();
  }

  bool number(double& value) {
    std::string_view text(at_, static_cast<std::size_t>(end_ - at_));
    const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
    if (plus) text.remove_prefix(1);
    char copy[max_number_chars];
    if (format_.decimal != '.') text = with_point(text, copy);
    double found;
    const std::size_t size = parse(text, found);
    if (size == 0 || !ends_number(at_ + plus + size)) return false;
    value = found;
    if (!(looks[column_] & other)) looks[column_] |= looks_of(text.substr(0, size));
    at_ += plus + size;
    return true;
  }

  /// A copy of a number's first characters with a decimal point instead of a comma; a point ends it.
  std::string_view with_point(std::string_view text, char* copy) const {
    const std::size_t size =
        std::min(text.substr(0, max_number_chars).find('.'), std::min(text.size(), max_number_chars));
    std::replace_copy(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(size), copy, format_.decimal,
                      '.');
    return {copy, size};
  }

  bool ends_number(const char* at) const {
    return at == end_ || *at == '\n' || *at == '\r' || *at == ' ' || *at == '"' || *at == '\t' ||
           *at == format_.delimiter;
  }

  bool word(bool quoted) {
    const char* stop = at_;
    while (stop < end_ && *stop != '\n' && *stop != '\r' && *stop != (quoted ? '"' : format_.delimiter) &&
           !(format_.delimiter == 0 && (*stop == ' ' || *stop == '\t')))
      ++stop;
    const char* last = stop;
    while (last > at_ && last[-1] == ' ') --last;
    const std::string_view text(at_, static_cast<std::size_t>(last - at_));
    at_ = stop;
    return std::find(format_.words.begin(), format_.words.end(), text) != format_.words.end();
  }

  bool skip_text() {
    if (*at_ == '"') return false;  // may contain delimiters
    while (!ends_cell()) ++at_;
    skip_blanks();
    return true;
  }

  const RowFormat& format_;
  const char* at_;
  const char* end_;
  std::size_t column_ = 0;
};

/// How often a character occurs; bytes are counted in bytes, so that it takes little time next to parsing.
std::size_t count_of(char character, std::string_view text) {
  std::size_t total = 0;
  for (; !text.empty(); text.remove_prefix(std::min<std::size_t>(text.size(), 128))) {
    std::uint8_t found = 0;
    for (const char each : text.substr(0, 128))
      found = static_cast<std::uint8_t>(found + (each == character));
    total += found;
  }
  return total;
}

/// The used columns (p, n) of all rows; nothing if a line is anything but a row of numbers.
struct Parsed {
  std::unique_ptr<double[]> values;
  std::size_t rows = 0, stride = 0, short_rows = 0;
  std::vector<std::uint8_t> looks;
};

Parsed parsed(std::string_view text, const RowFormat& format) {
  const auto columns = static_cast<std::size_t>(std::count(format.used.begin(), format.used.end(), true));
  const std::size_t stride = count_of(text.find('\n') == text.npos ? '\r' : '\n', text) + 1;
  Parsed found{std::make_unique_for_overwrite<double[]>(columns * stride), 0, stride, 0, {}};
  RowReader reader(format, text);
  for (; reader.next_line(); ++found.rows)
    if (found.rows == stride || !reader.read(found.values.get() + found.rows, stride)) return {};
  found.short_rows = reader.short_rows;
  found.looks = std::move(reader.looks);
  return found;
}

using Columns = nb::ndarray<nb::numpy, double, nb::ndim<2>>;

/// The used columns (p, n) of rows of numbers between two bytes of a text, how many of the last rows are
/// short, and the looks of every column; None if a line is anything else.
std::optional<nb::tuple> number_rows(const nb::bytes& text, std::size_t begin, std::size_t end,
                                     const std::string& delimiter, const std::string& decimal,
                                     const std::vector<bool>& used, const std::vector<std::string>& words) {
  if (begin > end || end > text.size() || delimiter.size() > 1 || decimal.size() != 1)
    throw nb::value_error("bytes in order and one character for each sign are needed");
  const RowFormat format{delimiter.empty() ? '\0' : delimiter[0], decimal[0], words, used};
  Parsed found;
  {
    const nb::gil_scoped_release others;
    found = parsed({text.c_str() + begin, end - begin}, format);
  }
  if (!found.values) return std::nullopt;
  double* data = found.values.release();
  nb::capsule owner(data, [](void* memory) noexcept { delete[] static_cast<double*>(memory); });
  const auto columns = static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
  const Columns values(data, {columns, found.rows}, owner, {static_cast<std::int64_t>(found.stride), 1});
  return nb::make_tuple(values, found.short_rows, nb::bytes(found.looks.data(), found.looks.size()));
}

}  // namespace

void bind_number_rows(nb::module_& module) {
  module.def("number_rows", &number_rows, nb::arg("text"), nb::arg("begin"), nb::arg("end"),
             nb::arg("delimiter"), nb::arg("decimal"), nb::arg("used"), nb::arg("words"));
}

}  // namespace needleforce::python
