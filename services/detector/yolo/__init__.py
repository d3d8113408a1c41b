"""The backend `yolo`: a learned model proposes where the pad may be, and `aided` looks there."""
