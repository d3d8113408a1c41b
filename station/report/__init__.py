"""One flight as a page that opens anywhere: pictures and tables in one HTML file."""
