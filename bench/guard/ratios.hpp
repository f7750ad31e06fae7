// What the guard compares with: how many times faster than the frozen code each row was when somebody last looked, per processor
// and compiler. A text file, one row per line: machine, instruction set, number type, work, ratio.
#pragma once

#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>
#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace guard {

// "AuthenticAMD-25-17-gcc12": vendor, family, model, compiler. Ratios of another processor or compiler are a guide only.
inline std::string machine() {
    std::ostringstream name;
#if defined(__x86_64__)
    unsigned a = 0, b = 0, c = 0, d = 0;
    __get_cpuid(0, &a, &b, &c, &d);
    for (const unsigned part : {b, d, c})
        for (unsigned shift = 0; shift < 32; shift += 8) name << static_cast<char>((part >> shift) & 0xFFU);
    __get_cpuid(1, &a, &b, &c, &d);
    const unsigned family = ((a >> 8) & 0xFU) + ((a >> 20) & 0xFFU), model = ((a >> 4) & 0xFU) + ((a >> 12) & 0xF0U);
    name << '-' << family << '-' << model;
#else
    name << "other";
#endif
#if defined(__clang__)
    name << "-clang" << __clang_major__;
#else
    name << "-gcc" << __GNUC__;
#endif
    return name.str();
}

class Ratios {
public:
    explicit Ratios(std::string path) : path_(std::move(path)) {
        std::ifstream file(path_);
        for (std::string line; std::getline(file, line);) {
            std::istringstream words(line);
            std::string owner, set, number, work;
            double ratio = 0.0;
            if (line.empty() || line[0] == '#') head_.push_back(line);
            else if (words >> owner >> set >> number >> work >> ratio) rows_[owner][set + " " + number + " " + work] = ratio;
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

    // The least that any processor reached; 0 where nothing is stored.
    double least(const std::string& row) const {
        double least = 0.0;
        for (const auto& [owner, rows] : rows_)
            if (const double r = of(owner, row); r > 0.0 && (least == 0.0 || r < least)) least = r;
        return least;
    }

    void set(const std::string& owner, const std::string& row, double ratio) { rows_[owner][row] = ratio; }
    void forget(const std::string& owner) { rows_.erase(owner); }

    void save() const {
        std::ofstream file(path_);
        for (const std::string& line : head_) file << line << '\n';
        for (const auto& [owner, rows] : rows_)
            for (const auto& [row, ratio] : rows) {
                char text[32];
                std::snprintf(text, sizeof text, "%.2f", ratio);
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
