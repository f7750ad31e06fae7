from .fleet import Fleet, fleet
from .found import AxisState, Change, Course, Sibling, Trends
from .trends import trends

__all__ = ["AxisState", "Change", "Course", "Fleet", "Sibling", "Trends", "fleet", "trends"]
