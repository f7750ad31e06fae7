// What the guard compares with: instructions per candidate and sample of each row when somebody last looked, per compiler.
// A text file, one row per line: compiler, instruction set, number type, work, count.
#pragma once

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace guard {

// "gcc12". Another compiler's counts are a guide only.
inline std::string compiler() {
#if defined(__clang__)
    return "clang" + std::to_string(__clang_major__);
#else
    return "gcc" + std::to_string(__GNUC__);
#endif
}

class Counts {
public:
    explicit Counts(std::string path) : path_(std::move(path)) {
        std::ifstream file(path_);
        if (!file) throw std::runtime_error(path_ + ": cannot be read");
        for (std::string line; std::getline(file, line);) {
            std::istringstream words(line);
            std::string owner, set, number, work;
            double count = 0.0;
            if (line.empty() || line[0] == '#') head_.push_back(line);
            else if (words >> owner >> set >> number >> work >> count) rows_[owner][set + " " + number + " " + work] = count;
            else throw std::runtime_error(path_ + ": not a row: " + line);
        }
    }

    bool knows(const std::string& owner) const { return rows_.count(owner) != 0; }

    // 0 where nothing is stored.
    double of(const std::string& owner, const std::string& row) const {
        const auto rows = rows_.find(owner);
        if (rows == rows_.end()) return 0.0;
        const auto at = rows->second.find(row);
        return at == rows->second.end() ? 0.0 : at->second;
    }

    // The most that any compiler needed; 0 where nothing is stored.
    double most(const std::string& row) const {
        double most = 0.0;
        for (const auto& [owner, rows] : rows_) most = std::max(most, of(owner, row));
        return most;
    }

    void set(const std::string& owner, const std::string& row, double count) { rows_[owner][row] = count; }
    void forget(const std::string& owner) { rows_.erase(owner); }

    void save() const {
        std::ofstream file(path_);
        for (const std::string& line : head_) file << line << '\n';
        for (const auto& [owner, rows] : rows_)
            for (const auto& [row, count] : rows) {
                char text[32];
                std::snprintf(text, sizeof text, "%.3f", count);
                file << owner << ' ' << row << ' ' << text << '\n';
            }
        if (!file.flush()) throw std::runtime_error(path_ + ": cannot be written");
    }

private:
    std::string path_;
    std::vector<std::string> head_;
    std::map<std::string, std::map<std::string, double>> rows_;
};

}  // namespace guard
