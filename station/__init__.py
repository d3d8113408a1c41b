"""The ground station, where people sit: the command line, starting and watching services, flights, reports."""
